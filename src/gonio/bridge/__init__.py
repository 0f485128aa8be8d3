"""The only package that imports Mitsuba: variants, plugins for Gonio's models, and Mitsuba's BSDFs as materials."""

from ..files import check_current_folder

check_current_folder()  # if it has been deleted, importing Mitsuba ends the process
