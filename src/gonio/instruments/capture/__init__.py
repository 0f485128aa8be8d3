"""Materials measured from photographs of a ball, or of a flat sample, under a lamp in several places (Marschner1999).

`calibration` (the file with camera, sample and lamps), `photographs` (files to radiance), `geometry` (the point and
directions of each pixel), `pixels` (usable pixels, and BRDF samples from them), `fitting` (a material together with the
errors of the calibration), `planning` (which photograph to take next), `rehearsal` (photographs that Gonio renders),
`run` (the whole procedure).
"""
