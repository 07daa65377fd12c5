"""Which argument it was that names triangles which there are not."""

import numpy as np
import pytest

import rtfmesh

BOX = rtfmesh.sample("box")
COUNT = len(BOX.faces)
ATTRIBUTES = {
    "vertex": {"weight": BOX.vertices[:, 0]},
    "face": {
        "side": (np.arange(COUNT) // 2 % 2).astype(np.int32),
        "single": np.arange(COUNT) % 2,
        "nowhere": np.zeros(COUNT, np.uint8),
        "everywhere": np.ones(COUNT, np.uint8),
    },
}
NO_LABEL = "no triangle has the label"


@pytest.mark.parametrize("argument", ["keep", "only"])
@pytest.mark.parametrize(
    ("value", "says"),
    [
        ("label:zz", f"{NO_LABEL} 'zz'; use a label that `attributes.face` has"),
        ("label:side:7", f"{NO_LABEL} 'side:7'; use a label"),
        (["label:side:0", "label:zz"], f"{NO_LABEL} 'zz'; use a label"),
        (("label:side:0", "label:a=b"), f"{NO_LABEL} 'a=b'; use a label"),
        ("selection:zz", "no numeric attribute of triangles or vertices is named 'zz'; use one of these: "),
        ("selection:nowhere", "the attribute 'nowhere' is 0 on all triangles; select some"),
    ],
)
def test_the_argument_is_named(argument, value, says, remesher):
    with pytest.raises(rtfmesh.InputError) as raised:
        remesher.remesh(BOX, 200, attributes=ATTRIBUTES, **{argument: value})
    assert str(raised.value).startswith(f"`{argument}`: {says}")


@pytest.mark.parametrize("value", ["label:zz=0.1", ["label:side:0=0.5", "label:zz=10%"]])
def test_refine_is_named_too(value, remesher):
    with pytest.raises(rtfmesh.InputError, match=rf"^`refine`: {NO_LABEL} 'zz'; use a label"):
        remesher.remesh(BOX, 200, attributes=ATTRIBUTES, refine=value)


def test_of_several_arguments_the_wrong_one_is_named(remesher):
    wanted = {"attributes": ATTRIBUTES, "refine": "label:side:0=0.5"}
    with pytest.raises(rtfmesh.InputError, match=r"^`keep`: .* 'side:5'"):
        remesher.remesh(BOX, 200, keep="label:side:5", **wanted)
    with pytest.raises(rtfmesh.InputError, match=r"^`refine`: .* 'side:5'"):
        remesher.remesh(BOX, 200, keep="label:side:1", **{**wanted, "refine": "label:side:5=0.5"})


def test_what_only_leaves_is_told_in_its_words(remesher):
    for value in (np.zeros(COUNT, bool), np.empty(0, int)):
        with pytest.raises(rtfmesh.InputError, match=r"^`only`: all triangles are kept; give `only` more"):
            remesher.remesh(BOX, 200, only=value)
    with pytest.raises(rtfmesh.InputError, match=r"^`only`: .*; give `only` more triangles$"):
        remesher.remesh(BOX, 200, attributes=ATTRIBUTES, only="label:single:0")
    with pytest.raises(rtfmesh.InputError, match=r"^`keep`: all triangles are kept; keep fewer triangles$"):
        remesher.remesh(BOX, 200, attributes=ATTRIBUTES, keep="selection:everywhere")


def test_the_whole_counts_where_only_leaves_too_few_vertices(torus, remesher):
    right = torus.vertices[torus.faces].mean(axis=1)[:, 0] > 0.8
    with pytest.raises(rtfmesh.InputError, match=r"the triangles outside of `only` .*give `only` more"):
        remesher.remesh(torus, 100, only=right)
    with pytest.raises(rtfmesh.InputError, match=r"the triangles of `keep` .*keep fewer triangles"):
        remesher.remesh(torus, 100, keep=~right)


def test_what_a_callback_raises_is_left_as_it_is(sphere, remesher):
    class OwnError(rtfmesh.InputError):
        pass

    own = OwnError(f"{NO_LABEL} 'zz' in the progress")

    def told(_):
        raise own

    with pytest.raises(OwnError) as raised:
        remesher.remesh(sphere, 5000, quality="best", only=np.ones(len(sphere.faces), bool), progress=told)
    assert raised.value is own
