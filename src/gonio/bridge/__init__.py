"""The only importer of Mitsuba: its engine, adapter, native BSDFs and scene files."""

from ..files import check_current_folder

check_current_folder()  # if it has been deleted, importing Mitsuba ends the process
