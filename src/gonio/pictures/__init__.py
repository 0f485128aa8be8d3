"""Pictures: files, formats, metrics, exposures and denoising."""
