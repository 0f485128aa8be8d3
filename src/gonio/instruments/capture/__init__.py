"""Measure materials from photographs of a ball or a flat sample, lit by a lamp at several positions (Marschner1999).

calibration  the calibration file: camera, sample and lamps
photographs  conversion of files to radiance
geometry     the point and the directions at each pixel
pixels       selection of usable pixels, and conversion to BRDF samples
fitting      a fit of the material together with the errors of the calibration
planning     choice of the next photograph to take
rehearsal    renders of the photographs
run          the complete procedure
"""
