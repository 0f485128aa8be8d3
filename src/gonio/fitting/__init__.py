"""Fits of materials to measurements: `data` (measured values), `parameters` (free parameters), `solver`, `fit`."""
