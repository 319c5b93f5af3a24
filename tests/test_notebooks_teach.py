"""What notebooks teach with: equations beside the functions that compute them, house words, questions, links."""

import ast
import re
from pathlib import Path

import nbformat
import pytest

NOTEBOOKS = Path(__file__).resolve().parent.parent / "notebooks"
FIGURES = sorted(NOTEBOOKS.glob("*.ipynb"))
ALL = [*FIGURES, *sorted((NOTEBOOKS / "exercises").glob("*.ipynb"))]
PAGES = [*ALL, NOTEBOOKS / "GLOSSARY.md", NOTEBOOKS / "exercises" / "README.md"]

COMPUTED_BY = {
    1: "objective.objective",
    2: "losses.silhouette",
    3: "losses.depths",
    4: "losses.overlap",
    5: "losses.extrusion",
    6: "density.mesh_density",
}
LINK = re.compile(r"""\[([^\]\n]*)\]\(([^)\s]+)(?:\s+"[^"\n]*")?\)""")
MENTION = re.compile(r"\bEq(?:uation|\.) ?(\d(?:(?:, | and | to |-)\d)*)(?!\d)")
CODE, MATH = r"```.*?```|`[^`\n]*`", r"\$\$.*?\$\$|\$[^$\n]+\$"


def anchor(heading: str) -> str:
    """What GitHub and Sphinx make of a heading."""
    return re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-")


GLOSSARY = (NOTEBOOKS / "GLOSSARY.md").read_text()
ANCHORS = {anchor(heading) for heading in re.findall(r"^#+ (.+)$", GLOSSARY, re.M)}
WORDS = {anchor(heading): heading.split(", ") for heading in re.findall(r"^### (.+)$", GLOSSARY, re.M)}


def each(pages):
    """The test once for each page."""
    return pytest.mark.parametrize("path", pages, ids=lambda path: path.name)


def read(path: Path) -> str:
    """The text of a page; of a notebook its markdown."""
    if path.suffix == ".md":
        return path.read_text()
    notebook = nbformat.read(path, as_version=4)
    return "\n\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")


def mentioned(text: str) -> set[int]:
    """The numbers of the equations that a text names."""
    found = set()
    for numbers in MENTION.findall(text):
        named = [int(number) for number in re.findall(r"\d", numbers)]
        found |= set(range(named[0], named[-1] + 1)) if re.search("to|-", numbers) else set(named)
    return found


def typeset(text: str) -> dict[int, str]:
    """Number -> equation, of blocks that stand on a line of their own with blank lines about them."""
    return {int(n): block for block, n in re.findall(r"(?:\A|\n\n)(\$\$[^\n]*\\tag\{(\d)\}\$\$)(?=\n\n|\n?\Z)", text)}


def defined(path: Path) -> set[str]:
    """The functions, classes and methods (`Class.method`) of a file; of a package's `__init__.py` the package."""
    names = {path.parent.name} if path.name == "__init__.py" else set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names |= {node.name, f"{path.stem}.{node.name}"}
        if isinstance(node, ast.ClassDef):
            names |= {f"{node.name}.{part.name}" for part in node.body if isinstance(part, ast.FunctionDef)}
    return names


def unlinked(text: str) -> list[str]:
    """The glossary's words that a text uses before it links them; headings, code and mathematics do not count."""
    text = re.sub(rf"{CODE}|{MATH}|^#+ [^\n]*$|<[^>\n]+>", " ", text, flags=re.S | re.M)
    prose = LINK.sub(lambda link: f"\0{link[2].partition('#')[2]}\0" if "GLOSSARY.md" in link[2] else " ", text)
    found = []
    for word, forms in WORDS.items():
        either = "|".join(re.escape(form) for form in forms)
        first = re.search(rf"(?<![\w-])(?:{either})(?![\w-])|\0{word}\0", prose, re.I)
        if first and first[0] != f"\0{word}\0":
            found.append(prose[max(first.start() - 40, 0) : first.end() + 40])
    return found


def test_these_tests_see_what_they_look_for():
    assert mentioned("Eq. 3 and 4, then Eq. 2-4 (Equation 1), in 6 boxes") == {1, 2, 3, 4}
    assert mentioned("Eq. 1, 2, 4 and 5; Eq. 2 to 4; Equations, an Eq. and Seq. 6") == {1, 2, 3, 4, 5}
    assert typeset("words\n\n$$a\\tag{1}$$\n\nwords $$b\\tag{2}$$\n\n$$c\\tag{3}$$") == {
        1: "$$a\\tag{1}$$",
        3: "$$c\\tag{3}$$",
    }
    assert unlinked("## Effort\n\n`effort`, the [effort](GLOSSARY.md#effort), and more effort") == []
    assert unlinked("## Words\n\n[no effort](other.md), but effort before the [effort](GLOSSARY.md#effort)") != []


@each(ALL)
def test_an_equation_is_typeset_where_it_is_first_named_and_linked_to_its_function(path):
    wanted, shown = typeset(GLOSSARY), {}
    assert set(wanted) == set(COMPUTED_BY)
    for cell in nbformat.read(path, as_version=4).cells:
        shown |= typeset(cell.source)
        assert mentioned(cell.source) <= set(shown), cell.source
    assert shown == {number: wanted[number] for number in shown}
    links = LINK.findall(read(path))
    for number in shown:
        name = COMPUTED_BY[number]
        assert any(text == f"`{name}`" and url.endswith(f"/{name.split('.')[0]}.py") for text, url in links), name


@each(PAGES)
def test_links_lead_to_what_they_name(path):
    for name, url in LINK.findall(read(path)):
        file, _, place = url.partition("#")
        target = (path.parent / file).resolve()
        assert target.exists(), url
        assert not place or place in ANCHORS, url
        if target.suffix == ".py" and name.startswith("`"):
            assert name.strip("`") in defined(target), (name, url)
        if target.suffix == ".ipynb" and re.fullmatch(r"\w+", name):
            assert name == target.stem


@each(ALL)
def test_a_house_word_is_linked_where_it_is_used_first(path):
    assert len(WORDS) > 20
    assert unlinked(read(path)) == []


@each(FIGURES)
def test_a_notebook_asks_two_questions_and_folds_the_answers(path):
    folded = r"^\*\*\d\.\*\* [^\n]*\n\n<details><summary>Answer</summary>\n\n(.*?)\n\n</details>$"
    answers = re.findall(folded, read(path), re.S | re.M)
    assert len(answers) == 2
    assert all(len(answer.split()) >= 20 for answer in answers)


@each(FIGURES)
def test_a_notebook_ends_with_links_to_others_to_code_and_to_an_exercise(path):
    last = nbformat.read(path, as_version=4).cells[-1].source
    assert last.startswith("**See also**")
    for kind in (r"\]\(\w+\.ipynb\)", r"\]\(\.\./rasp_core/[\w/]+\.py\)", r"\]\(exercises/\d+_\w+\.ipynb\)"):
        assert re.search(kind, last), kind


@each(PAGES)
def test_mathematics_is_in_a_form_that_jupyter_mathjax_and_katex_read(path):
    text = re.sub(CODE, "", read(path), flags=re.S)
    assert not re.search(r"\\[(\[]|\\begin\{(?:equation|align)", text)
    assert "$" not in re.sub(MATH, "", text, flags=re.S)
    for line in text.splitlines():
        assert "$$" not in line or re.fullmatch(r"\$\$.*\$\$", line), line
    for formula in re.findall(MATH, text, re.S):
        assert formula.count("{") == formula.count("}"), formula
