"""YAML with the line of each value, so that a mistake can say where it is."""

from typing import Any

import yaml

from .mistakes import Mistakes

Path = tuple[str | int, ...]


def load(name: str, text: str) -> tuple[Any, dict[Path, int]]:
    """Gives the value of a document, and the line of everything in it; a key that stands twice is a mistake."""
    lines: dict[Path, int] = {}
    twice: list[str] = []
    loader = yaml.SafeLoader(text)

    def value(node: yaml.Node, path: Path) -> Any:
        lines[path] = node.start_mark.line + 1
        if isinstance(node, yaml.MappingNode):
            found: dict[str, Any] = {}
            for key_node, value_node in node.value:
                key = str(key_node.value)
                line = key_node.start_mark.line + 1
                if key in found:
                    twice.append(f"{name}:{line}: the key `{key}` stands twice")
                found[key] = value(value_node, (*path, key))
                lines[(*path, key)] = line
            return found
        if isinstance(node, yaml.SequenceNode):
            return [value(item, (*path, number)) for number, item in enumerate(node.value)]
        return loader.construct_object(node, deep=True)

    try:
        node = loader.get_single_node()
        result = None if node is None else value(node, ())
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise Mistakes([f"{name}:{line}: this is no YAML: {error.problem}"]) from error
    finally:
        loader.dispose()
    if twice:
        raise Mistakes(twice)
    return result, lines
