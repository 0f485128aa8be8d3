"""The virtual gonioreflectometer: rays through a surface (`rays`), what the detector saw (`readings`), files of it."""
