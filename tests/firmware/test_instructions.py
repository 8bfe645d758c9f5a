"""The counter of instructions is exact: a filter whose cost is known to the instruction says so."""

import numpy as np
import pytest

from factorlab.firmware.instructions import IMU_F32, IMU_Q, count_instructions, imu_q
from sequential.errors import DataError, ToolMissingError
from sequential.sensors import ImuRecording

# Spins magnetometer x times round a loop of two instructions, after three and before the return.
# Its attitude shows whether initialised variables were filled, and others cleared.
SPINNING = """
#include "spin_{suffix}.h"
static volatile int filled[3] = {{5, 6, 7}}, cleared[300];
void spin_{suffix}_defaults(struct spin_{suffix}_settings *s) {{ s->gain = 0; }}
void spin_{suffix}_derive(const struct spin_{suffix}_settings *s, {rate} struct spin_{suffix}_derived *d)
{{ d->gain = s->gain; {use} }}
void spin_{suffix}_start(struct spin_{suffix}_state *s, const struct spin_{suffix}_derived *d,
                         const struct imu_{suffix} *i) {{ (void)d; (void)i; s->count = 0; }}
__attribute__((naked))
void spin_{suffix}_step(struct spin_{suffix}_state *s, const struct spin_{suffix}_derived *d,
                        const struct imu_{suffix} *i, {interval} since)
{{ __asm("{load}\\n1: subs r3, #1\\n bgt 1b\\n bx lr"); }}
void spin_{suffix}_attitude(const struct spin_{suffix}_state *s, {component} *q)
{{ q[0] = {one}; q[1] = ({component})(s->count + filled[2] - 7);
  q[2] = ({component})(filled[0] - 5); q[3] = ({component})cleared[299]; }}
"""
DECLARED = """
#include <stdint.h>
#include "{imu}"
struct spin_{suffix}_settings {{ int gain; }};
struct spin_{suffix}_derived {{ int gain; }};
struct spin_{suffix}_state {{ int count; }};
void spin_{suffix}_defaults(struct spin_{suffix}_settings *);
void spin_{suffix}_derive(const struct spin_{suffix}_settings *, {rate} struct spin_{suffix}_derived *);
void spin_{suffix}_start(struct spin_{suffix}_state *, const struct spin_{suffix}_derived *,
                         const struct imu_{suffix} *);
void spin_{suffix}_step(struct spin_{suffix}_state *, const struct spin_{suffix}_derived *,
                        const struct imu_{suffix} *, {interval});
void spin_{suffix}_attitude(const struct spin_{suffix}_state *, {component} *);
"""
KINDS = {
    "f32": {
        "rate": "", "use": "", "interval": "float", "component": "float", "one": "1.0f",
        "load": "vldr s15, [r2, #24]\\n vcvt.s32.f32 s15, s15\\n vmov r3, s15",
    },
    "q": {
        "rate": "uint16_t hz,", "use": "(void)hz;", "interval": "uint8_t", "component": "int32_t",
        "one": "1 << 30", "load": "nop\\n nop\\n ldrsh r3, [r2, #18]",
    },
}  # fmt: skip


@pytest.fixture
def spin(tmp_path, firmware_dir):
    for suffix, words in KINDS.items():
        known = {"suffix": suffix, "imu": firmware_dir / "core" / "imu.h", **words}
        (tmp_path / f"spin_{suffix}.h").write_text(DECLARED.format(**known), encoding="utf-8")
        (tmp_path / f"spin_{suffix}.c").write_text(SPINNING.format(**known), encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(("suffix", "dtype"), [("f32", IMU_F32), ("q", IMU_Q)])
@pytest.mark.usefixtures("arm_toolchain", "qemu")
def test_every_update_is_counted_to_the_instruction(spin, suffix, dtype, rng):
    samples = np.zeros(5000, dtype)
    rounds = rng.integers(1, 30000, 5000)
    samples["mag"][:, 0] = rounds
    counts = count_instructions(f"spin_{suffix}", samples, header=spin / f"spin_{suffix}.h")
    np.testing.assert_array_equal(counts.instructions, 3 + 2 * rounds)
    np.testing.assert_array_equal(counts.world_q_body, np.tile([1.0, 0, 0, 0], (5000, 1)))
    assert counts.worst == 3 + 2 * rounds.max()
    assert counts.text[f"spin_{suffix}.spin_{suffix}_step"] >= 12


@pytest.mark.usefixtures("arm_toolchain", "qemu")
def test_a_module_that_does_not_build_is_told_in_the_compilers_words(spin):
    (spin / "spin_f32.c").write_text("int broken(", encoding="utf-8")
    with pytest.raises(ToolMissingError, match=r"spin_f32\.c:1"):
        count_instructions("spin_f32", np.zeros(1, IMU_F32), header=spin / "spin_f32.h")


def test_samples_of_the_other_kind_are_refused():
    with pytest.raises(DataError, match="mahony_q takes samples of dtype"):
        count_instructions("mahony_q", np.zeros(1, IMU_F32))


def test_fixed_point_samples_saturate():
    recording = ImuRecording(
        np.arange(2) / 100, gyro=[[200, -200, 1], [0, 0, 0]], accel=[[0, 0, 9.81], [0, 0, 200]]
    )
    samples = imu_q(recording)
    assert samples["gyro"][0].tolist() == [2**31 - 1, -(2**31), 2**24]
    assert samples["accel"][:, 2].tolist() == [2511, 2**15 - 1]
    assert not samples["mag"].any()
