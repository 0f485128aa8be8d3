"""Fit materials to measurements: `data` (fitted values), `parameters` (free parameters), `solver`, `fit`."""
