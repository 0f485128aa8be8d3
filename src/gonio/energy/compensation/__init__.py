"""What single scattering misses, and the lobes that give it back: what the compensated materials stand on.

`missing.missing_energy(base)` answers with one of three: `reflecting.Reflecting` (metals, glass that only reflects),
`glass.Glass` (both sides), `measured.Measured` (any other base that reflects). All speak the same words.
"""
