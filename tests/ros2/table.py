"""The table of topics in services/ros2/README.md: what people are told must be what is there."""

from pathlib import Path

README = Path(__file__).parents[2] / "services/ros2/README.md"
BEST_EFFORT, RELIABLE, LASTING = "sensor data", "reliable", "lasting"


def topics(node="r1"):
    """Topic, type and quality of service of each row."""
    rows = []
    for line in README.read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| `") and len(cells) == 6:
            topic, kind, quality = (cell.strip("`") for cell in cells[:3])
            topic = topic if topic.startswith("/") else f"/{node}/{topic}"
            rows.append((topic, kind, quality))
    assert len(rows) == 18, rows
    return rows
