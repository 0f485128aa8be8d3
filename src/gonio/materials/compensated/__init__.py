"""Materials with the energy restored that single scattering loses."""
