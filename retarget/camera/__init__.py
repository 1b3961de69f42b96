"""Pictures in, landmarks out: where pictures come from, detectors, the head's pose and measures of the face."""
