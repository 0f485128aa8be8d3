"""Light transport through a scene: integrators, lights, media, random numbers, passes."""
