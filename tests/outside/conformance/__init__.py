"""Raw files with known answers, and what raw converters make of them: `scripts/conformance`, docs/conformance.md."""
