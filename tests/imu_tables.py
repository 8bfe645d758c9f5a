"""Recordings written as the tables of loggers and spreadsheets."""


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def rows(recording, *, scale=(1.0, 1.0), sep=",", decimal=".", stamp=lambda s: f"{s:.4f}"):
    accel, gyro = recording.accel * scale[0], recording.gyro * scale[1]
    lines = []
    for s, a, g in zip(recording.seconds, accel, gyro, strict=True):
        cells = [stamp(s), *(f"{v:.9g}" for v in (*a, *g))]
        lines.append(sep.join(cell.replace(".", decimal) for cell in cells))
    return lines
