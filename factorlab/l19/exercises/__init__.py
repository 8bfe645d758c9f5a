"""Exercises E1-E4 of the course: a student's own file against the statement, and what to mend.

Imported in the student's process too, so it imports nothing of the library.
"""

from factorlab.l19.exercises.student import StudentRun, run_student

__all__ = ["StudentRun", "run_student"]
