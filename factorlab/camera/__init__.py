"""A camera's calibration as a job: pictures in; verdicts, page, and files for other programs out."""

from factorlab.camera.calibrated import CalibratedCamera, CameraSettings
from factorlab.camera.document import camera_document
from factorlab.camera.exports import export_files
from factorlab.camera.job import calibrate_held, calibrate_pictures
from factorlab.camera.pictures import held_pictures, open_pictures

__all__ = [
    "CalibratedCamera",
    "CameraSettings",
    "calibrate_held",
    "calibrate_pictures",
    "camera_document",
    "export_files",
    "held_pictures",
    "open_pictures",
]
