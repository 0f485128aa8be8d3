"""How light is followed through a scene: integrators, lights, media, random numbers, passes."""
