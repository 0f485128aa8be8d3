"""The only importer of Mitsuba: its engine, adapter, native BSDFs and scene files."""
