"""TP3, suite. Le filtre sur la carte, virgule fixe sur un AVR, flottant sur un Cortex-M4 : latence et gigue.

Le Kalman (angle + biais) de `43_tp3_attitude.py` tourne ici en C, dans l'image même qui se flashe, sur des
cartes émulées : un ATmega328P dans simavr, compté au cycle, et un Cortex-M4F dans QEMU, qui compte des
instructions.  Les échantillons arrivent par le bus I²C simulé d'un MPU-6050 ; l'angle sort cent fois par
seconde sur la liaison série.

- Le portage est-il juste ?  Mêmes échantillons entiers, même filtre en Python (64 bits) : on soustrait.
- Pourquoi la virgule fixe ?  Le même filtre en flottant tourne aussi sur l'AVR, qui n'a pas d'unité
  flottante : on compare les cycles.
- Latence : de l'échantillon en mémoire au premier octet de SA trame.  Le retard total contient encore la
  lecture I²C (0,46 ms), les octets sur le fil, puis l'USB du PC (1 à 20 ms) : le calcul n'en est pas la plus
  grosse part.
- Gigue : l'écart de la période des premiers octets à 10 ms.  Le temps de calcul dépend des données ; la trame
  part donc à une phase fixe après le tic, dans l'interruption du même compteur.

Sans les outils (avr-gcc, simavr, arm-none-eabi-gcc, QEMU), l'exemple dit ce qui manque et fait le reste.  Sur
une vraie carte : `factorlab record serial /dev/ttyACM0 -o attitude.csv --mode angles`.
"""

import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np
from figures import say

from factorlab.firmware.avr import CLOCK_HZ, emulate_avr
from factorlab.firmware.build import build
from factorlab.firmware.emulation import mpu6050_counts
from factorlab.firmware.m4 import emulate_m4
from sequential.attitude import TiltKalman, roll_pitch_yaw
from sequential.errors import ToolMissingError
from sequential.firmware import CTiltKalman
from sequential.sensors import ImuRecording

SECONDS = 24.0
SCALES = np.array([8 * 9.80665 / 32768] * 3 + [np.radians(2000) / 32768] * 3)  # ±8 g, ±2000 °/s
BAUD = 500_000
AVR, SLOW, M4, PC = "AVR, virgule fixe", "AVR, flottant", "Cortex-M4, flottant", "ce PC, flottant"
BOARDS = {
    AVR: ("avr", "tilt_q", emulate_avr),
    SLOW: ("avr", "tilt_f32", emulate_avr),
    M4: ("m4", "tilt_f32", emulate_m4),
}


record = import_module("43_tp3_attitude").record  # un nom de module ne commence pas par un chiffre


def samples():
    """Ce que lit un MPU-6050 : (N, 7) entiers de 16 bits ; le même en SI ; les angles vrais (N, 2)."""
    quiet, _, truth, origin = record(np.random.default_rng(3))
    counts = mpu6050_counts(quiet.slice(0.0, SECONDS))
    si = counts[:, [0, 1, 2, 4, 5, 6]] * SCALES
    t = np.arange(len(counts)) * 10_000_000
    return counts, ImuRecording(t, si[:, :3], si[:, 3:], name="TP3"), truth[: len(t)], origin


def angles(estimator, recording):
    """Roulis et tangage (N, 2), degrés."""
    return np.degrees(roll_pitch_yaw(estimator.estimate(recording).world_q_body)[:, :2])


def emulated(counts):
    """L'image de chaque carte, sur ces échantillons ; ce qui manque est dit."""
    found = {}
    for name, (target, used, emulate) in BOARDS.items():
        try:
            with tempfile.TemporaryDirectory() as folder:
                image = build(target, Path(folder), filter=used)
                found[name] = emulate(image.path, counts, mode="a"), image
        except ToolMissingError as missing:
            say(f"{name} : laissé de côté ({missing})")
    return found


def main():
    from claims import claim
    from figures import panels, save

    counts, recording, truth, origin = samples()
    say(f"{len(counts)} échantillons entiers à 100 Hz (bruits {origin})")
    reference = angles(TiltKalman(), recording)
    apart = {}
    try:
        apart[PC] = angles(CTiltKalman(), recording) - reference
    except ToolMissingError as missing:
        say(f"le C sur ce PC : laissé de côté ({missing})")
    boards = emulated(counts)
    for name, (emulation, _) in boards.items():
        apart[name] = np.degrees(emulation.roll_pitch_yaw[:, :2]) - reference
    for name, error in apart.items():
        say(f"{name:<20} écart au Python : {rms(error):.4f}° RMS, {np.abs(error).max():.4f}° au pire")
    for name, (emulation, image) in boards.items():
        tell(name, emulation, image)

    figure, (a, b, c) = panels(1, 3, size=(13.0, 4.0), title="TP3. Le filtre sur la carte : latence et gigue")
    draw_apart(a, recording.seconds, apart)
    draw_jitter(b, boards.get(AVR))
    draw_budget(c, {name: boards[name][0] for name in (AVR, SLOW) if name in boards})
    save(figure)
    check(apart, boards)
    claim("TP3", "erreur du même filtre en Python", rms((reference - truth)[1500:]), "° RMS", high=1.0)


def check(apart, boards):
    """Ce que l'exemple affirme, pour ce qui a pu tourner."""
    from claims import claim, table

    rows = []
    if AVR in boards:
        emulation, image = boards[AVR]
        source = "ATmega328P émulé au cycle"
        claim("TP3", "latence, au pire (AVR, virgule fixe)", 1e3 * emulation.latency[2:].max(), "ms",
              high=2.5, source=source)  # fmt: skip
        claim("TP3", "gigue de la période, au pire (AVR)", 1e6 * np.abs(emulation.jitter[2:]).max(), "µs",
              high=8.0, source=source)  # fmt: skip
        claim("TP3", "flash occupée (AVR)", image.flash, "octets", high=32_767, source=source)
    if {AVR, SLOW} <= set(boards):
        cycles = {name: np.nanmean(boards[name][0].update_cycles) for name in (AVR, SLOW)}
        claim("TP3", "cycles de la virgule fixe / du flottant (AVR)", cycles[AVR] / cycles[SLOW], high=0.5,
              source="ATmega328P émulé au cycle")  # fmt: skip
    for name, error in apart.items():
        claim("TP3", f"écart du C au Python ({name})", rms(error), "° RMS", high=0.01,
              source="ce PC" if name == PC else "carte émulée")  # fmt: skip
        assert np.abs(error).max() < 0.03
    for name, (emulation, image) in boards.items():
        assert emulation.lost == emulation.corrupt == 0, "aucune trame perdue"
        cost = emulation.update_cycles[2:]
        timed = [None, None] if name == M4 else [1e3 * emulation.latency[2:].max(),
                                                 1e6 * np.abs(emulation.jitter[2:]).max()]  # fmt: skip
        rows.append(
            [name, np.nanmean(cost), np.nanmax(cost), *timed, image.flash, image.ram, emulation.stack]
        )
    headings = ("carte", "mise à jour, moyenne (cycles ; instructions sur M4)", "au pire", ("latence", "ms"),
                ("gigue", "µs"), ("flash", "octets"), ("RAM", "octets"), ("pile", "octets"))  # fmt: skip
    if rows:
        table("Le filtre à 100 Hz sur chaque carte", headings, rows)


def tell(name, emulation, image):
    """Les réponses aux questions du TP."""
    cost = emulation.update_cycles[2:]
    say(f"{name} : {image.flash} octets de flash, {image.ram} de RAM, {emulation.stack} de pile")
    if name == M4:
        say(f"  mise à jour : {np.nanmean(cost):.0f} instructions en moyenne, {np.nanmax(cost):.0f} au pire")
        print("  (QEMU ne compte pas le temps : latence et gigue se mesurent sur l'AVR, ou à l'oscilloscope)")
        return
    latency, jitter = emulation.latency[2:], emulation.jitter[2:]
    say(f"  mise à jour : {np.nanmean(cost):.0f} cycles en moyenne, {np.nanmax(cost):.0f} au pire, "
          f"{np.nanmax(cost) / CLOCK_HZ / 0.01:.1%} des 10 ms")  # fmt: skip
    say(f"  latence au premier octet : {latency.mean() * 1e6:.0f} µs, {latency.max() * 1e6:.0f} µs au pire")
    say(f"  gigue de la période : ±{np.abs(jitter).max() * 1e6:.1f} µs ; trames perdues : {emulation.lost}")
    say(f"  le processeur dort {emulation.asleep:.0%} du temps")


def draw_apart(a, seconds, apart):
    """L'écart au Python dans le temps."""
    import figures

    whole = len(seconds) // 100 * 100
    colours = {PC: figures.GREEN, AVR: figures.BLUE, SLOW: figures.SKY, M4: figures.ORANGE}
    for name, error in apart.items():
        worst = np.abs(error[:whole]).reshape(-1, 200).max(axis=1)
        a.plot(seconds[:whole:100] + 0.5, worst, ".-", color=colours[name], linewidth=0.9, label=name)
    a.axhline(360 / 65536 / 2, color="black", linewidth=0.8, linestyle=":", label="demi-pas de la trame")
    a.set(title="C moins Python, même entrée", xlabel="temps (s)", ylabel="pire écart de la seconde (°)")
    a.set_yscale("log")
    a.legend(loc="center right", bbox_to_anchor=(1.0, 0.4))


def draw_jitter(b, board):
    """La période de chaque trame."""
    import figures

    b.set(title="Gigue : période moins 10 ms (AVR)", xlabel="temps (s)", ylabel="écart (µs)", ylim=(-10, 10))
    if board is None:
        b.text(0.5, 0.5, "pas de simavr ici", ha="center", transform=b.transAxes)
        return
    jitter = board[0].jitter[2:] * 1e6
    b.plot(np.arange(len(jitter)) * 0.01, jitter, ".", markersize=2, color=figures.BLUE)
    b.axhspan(-8, 8, color="#eeeeee", zorder=0, label="tolérance : ±8 µs")
    b.legend(loc="upper right")


def draw_budget(c, boards):
    """Où passe le temps, de l'échantillon en mémoire au dernier octet de sa trame."""
    import figures

    c.set(title="Le retard d'un échantillon", xlabel="depuis l'échantillon en mémoire (ms)")
    if not boards:
        c.text(0.5, 0.5, "pas de simavr ici", ha="center", transform=c.transAxes)
        return
    colours = (figures.BLUE, figures.GOLD, figures.GREEN)
    for name, emulation in boards.items():
        update = np.nanmedian(emulation.update_cycles) / CLOCK_HZ
        parts = [update, np.nanmedian(emulation.latency[2:]) - update, 24 * 10 / BAUD]
        starts = np.concatenate([[0.0], np.cumsum(parts)[:-1]])
        c.barh([name.replace(", ", ",\n")] * 3, np.array(parts) * 1e3, left=starts * 1e3, color=colours)
    for label, colour in zip(("calibration, filtre", "angles, phase", "24 octets"), colours, strict=True):
        c.barh(0, 0, color=colour, label=label)
    c.invert_yaxis()
    c.legend(loc="upper right")


def rms(values):
    """Moyenne quadratique."""
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    main()
