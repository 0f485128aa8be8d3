"""The virtual gonioreflectometer: rays (`rays`), detector readings (`readings`), files (`run`)."""
