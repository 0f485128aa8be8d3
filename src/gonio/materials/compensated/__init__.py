"""Materials with compensation of the energy lost by single scattering."""
