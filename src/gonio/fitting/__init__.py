"""Materials fitted to measurements: `data` (what is fitted to), `parameters` (what moves), `solver`, `fit`."""
