"""Light transport: integrators, lights, media, samplers, and the passes of a render."""
