"""From records to springs and back: identify, many, predict, info, synthesize."""
