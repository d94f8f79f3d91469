"""Generated files: types of a small document with every kind of schema, and the synchronous client."""

import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import generate

ORIGIN = {"type": "object", "required": ["lat_deg"], "properties": {"lat_deg": {"type": "number"}}}
AT = {"type": ["array", "null"], "description": "Where.", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}

SCHEMAS = {
    "Origin": ORIGIN,
    "Base": {"type": "object", "description": 'A \\ and """more""".', "properties": {"n": {"type": "integer"}}},
    "Shape": {
        "type": "object",
        "description": "One.\n\nTwo.",
        "required": ["kind", "at"],
        "properties": {
            "kind": {"$ref": "#/components/schemas/Kind"},
            "at": {"anyOf": [AT, {"$ref": "#/components/schemas/Origin"}]},
            "maybe": {"oneOf": [{"type": "null"}, {"$ref": "#/components/schemas/Origin", "description": "Perhaps."}]},
            "by_name": {"type": ["object", "null"], "additionalProperties": {"type": "boolean"}},
            "anything": {"description": "As it comes."},
            "inner": {"type": "object", "properties": {"only": {"const": "x"}}},
        },
        # Rules make no types.
        "allOf": [
            {"anyOf": [{"required": ["at"]}]},
            {"properties": {"kind": {"enum": ["a"]}, "by_name": {"type": "null"}}},
        ],
        "oneOf": [{"required": ["maybe"], "properties": {"kind": {"enum": ["a"]}}}],
    },
    "Kind": {"type": "string", "enum": ["a", "b"]},
    "Keyword": {"type": "object", "properties": {"from": {"enum": ["a", None]}}},
    "Tagged": {
        "oneOf": [
            {"type": "object", "required": ["tag"], "properties": {"tag": {"type": "string", "enum": ["big_one"]}}},
            {
                "allOf": [
                    {"$ref": "#/components/schemas/Base"},
                    {"type": "object", "required": ["tag"], "properties": {"tag": {"enum": ["small"]}}},
                ]
            },
        ]
    },
}

EXPECTED = [
    '''class Base(TypedDict):
    """A \\\\ and \'\'\'more\'\'\'."""

    n: NotRequired[int]
''',
    """Keyword = TypedDict(
    "Keyword",
    {
        "from": "NotRequired[Literal[\\"a\\", None]]",
    },
)
""",
    'Kind: TypeAlias = Literal["a", "b"]\n',
    """class ShapeInner(TypedDict):
    only: NotRequired[Literal["x"]]
""",
    '''class Shape(TypedDict):
    """One.

    Two.
    """

    kind: Kind
    # Where.
    at: list[float] | Origin | None
    # Perhaps.
    maybe: NotRequired[Origin | None]
    by_name: NotRequired[dict[str, bool] | None]
    # As it comes.
    anything: NotRequired[Any]
    inner: NotRequired[ShapeInner]
''',
    """class TaggedBigOne(TypedDict):
    tag: Literal["big_one"]
""",
    """class TaggedSmall(Base):
    tag: Literal["small"]
""",
    'Tagged: TypeAlias = "TaggedBigOne | TaggedSmall"\n',
]


def test_every_kind_of_schema_becomes_a_type():
    text = generate.module(SCHEMAS)
    for expected in EXPECTED:
        assert expected in text, text
    assert text.index("class Base") < text.index("class TaggedSmall(Base)")
    exec(text, {"__name__": "types_of_a_test"})


def test_the_synchronous_client_is_that_of_the_asynchronous_one():
    subprocess.run([sys.executable, generate.__file__, "--check"], check=True)
    text = generate.SYNC.read_text(encoding="utf-8")
    assert not re.findall(r"async|await|Async|__a", text.split("\n", 3)[3])
