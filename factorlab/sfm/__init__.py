"""Structure from motion as a job: photographs in; a model, what it is worth, and its files out."""

from factorlab.sfm.document import sfm_document
from factorlab.sfm.exports import model_files
from factorlab.sfm.job import SfmDone, SfmJob, run_sfm

__all__ = ["SfmDone", "SfmJob", "model_files", "run_sfm", "sfm_document"]
