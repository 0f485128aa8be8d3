"""The virtual gonioreflectometer: ray tracing (`rays`), detector readings (`readings`), measurements (`run`)."""
