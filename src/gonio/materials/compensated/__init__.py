"""Materials that compensate for the energy lost by single scattering."""
