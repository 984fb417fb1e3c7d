"""What commands share: options, paths, output, cautions."""
