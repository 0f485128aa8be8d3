"""The energy lost by single-scattering models, and the lobes that compensated materials add to restore it.

`missing.missing_energy(base)` returns one of `reflecting.Reflecting` (metals, glass that only reflects), `glass.Glass`
(both sides) and `measured.Measured` (any other base that reflects), all with the interface `lobe.MissingEnergy`.
"""
