"""What image viewers show of frames at each stage, beside what `preview` shows."""
