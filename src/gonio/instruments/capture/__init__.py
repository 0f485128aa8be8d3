"""Materials measured from photographs of a ball, or of a flat sample, under a lamp in several places (Marschner1999).

`calibration` (the file that says what stood where), `photographs` (files to radiance), `geometry` (where each pixel
looks), `pixels` (which of them count, and the samples that they are), `fitting` (a material with the faults of the
calibration beside it), `planning` (which photograph to take next), `rehearsal` (photographs that Gonio renders),
`run` (all of it).
"""
