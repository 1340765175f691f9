"""What the parts hand to the page: tables with verdicts on goals, and numbers for the plots."""

from dataclasses import dataclass, field


@dataclass
class Topic:
    """One table of the page."""

    name: str
    title: str
    text: str
    heads: list
    rows: list = field(default_factory=list)
    notes: list = field(default_factory=list)
    plots: dict = field(default_factory=dict)

    def missing(self, failures):
        """Says which rows are not there, and why."""
        for name, problem in failures.items():
            self.notes.append(f"{name} did not run: {problem}")

    def markdown(self, level="##"):
        """The topic; its numbers aligned to the right."""
        words = ("what", "peer", "goal", "goal by the clock", "stage", "up to", "program", "frame")
        right = ["---" if head in words else "---:" for head in self.heads]
        lines = [f"{level} {self.title}", "", self.text, ""]
        lines += [row_of(self.heads), row_of(right)] + [row_of(row) for row in self.rows] + [""]
        lines += [f"- {note}" for note in self.notes] + ([""] if self.notes else [])
        return "\n".join(lines)


def row_of(cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def figures(value, digits=3):
    """A number with so many digits that count, without an exponent."""
    if value == 0:
        return "0"
    text = f"{value:.{digits}g}"
    return f"{float(text):,.0f}".replace(",", "\u202f") if "e" in text or abs(value) >= 1000 else text


def goal(ratio, least):
    """The cell that tells a goal and whether it is reached."""
    return f"≥ {least:g}: {'reached' if ratio >= least else 'not reached'}"


def below(value, most, unit):
    return f"< {most:g} {unit}: {'reached' if value < most else 'not reached'}"
