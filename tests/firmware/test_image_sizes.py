"""Frames, call graphs and the deepest path, on listings whose answer is known."""

import pytest

from factorlab.firmware.stack import call_graph, deepest, frames
from sequential.errors import DataError

LISTING = """
00000080 <step>:
  80:\tf000 f8ac \tbl\t100 <correct>
  84:\tf7ff bffe \tb.w\t140 <finish>
  88:\td0fb      \tbeq.n\t80 <step+0x2>

00000100 <correct>:
 100:\tb510      \tpush\t{r4, lr}
 102:\tf000 f8ac \tbl\t140 <finish>

00000140 <finish>:
 140:\t4770      \tbx\tlr

00000160 <around>:
 160:\tf000 f8ac \tbl\t180 <back>

00000180 <back>:
 180:\tf000 f8ac \tbl\t160 <around>

000001a0 <through>:
 1a0:\t4798      \tblx\tr3
"""
OWN = {"step": 24, "correct": 16, "finish": 8, "around": 8, "back": 8, "through": 8}


def test_the_deepest_path_is_summed():
    calls, pushes = call_graph(LISTING)
    assert calls["step"] == {"correct", "finish"}
    assert deepest("step", calls, OWN, pushes) == (48, ("step", "correct", "finish"))


@pytest.mark.parametrize(
    ("entry", "said"), [("around", "calls itself"), ("through", "pointer"), ("nowhere", "no function")]
)
def test_what_has_no_bound_is_refused(entry, said):
    with pytest.raises(DataError, match=said):
        deepest(entry, *(call_graph(LISTING)[0], OWN, call_graph(LISTING)[1]))


def test_a_function_of_the_library_counts_its_pushes():
    calls, pushes = call_graph("00000010 <__mulsi3>:\n  10:\tcf 93 \tpush\tr28\n  12:\tdf 93 \tpush\tr29\n")
    assert deepest("__mulsi3", calls, {}, pushes)[0] == 2 + 2


def test_frames_are_read(tmp_path):
    (tmp_path / "a.su").write_text("a.c:12:6:step\t24\tstatic\na.c:30:6:other\t8\tdynamic,bounded\n")
    assert frames(tmp_path) == {"step": 24, "other": 8}
    (tmp_path / "b.su").write_text("b.c:1:1:loose\t8\tdynamic\n")
    with pytest.raises(DataError, match="loose"):
        frames(tmp_path)
