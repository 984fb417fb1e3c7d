"""Springs of which a catalogue states stiffness and damping, where no loops were recorded."""
