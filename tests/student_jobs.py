"""What the tests of the runner ask a student's file to do, in its own process."""

from factorlab.l19.exercises.calling import Caller
from factorlab.l19.exercises.fault import Stumble


def names_of(names, arguments, emit):
    emit(sorted(name for name in names if not name.startswith("_")))
    emit(arguments)


def call_f(names, arguments, emit):
    """Call f() of the file, and tell its value or the fault."""
    call = Caller(arguments["path"], limit_s=arguments.get("limit_s", 1.0))
    try:
        emit({"value": call(names["f"])})
    except Stumble as stumble:
        emit({"fault": stumble.fault.to_json()})


def broken(names, arguments, emit):
    emit("avant")
    raise ValueError("le vérificateur lui-même")


def broken_check(names, arguments, emit):
    raise KeyError("une faute du vérificateur")
