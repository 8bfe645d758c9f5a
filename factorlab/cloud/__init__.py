"""A point cloud from a file, as `factorlab cloud` looks at it, cleans it and lays it on another."""

from factorlab.cloud.document import cloud_document
from factorlab.cloud.exports import cloud_files
from factorlab.cloud.job import CloudJob, CloudSettings, work_on_cloud

__all__ = ["CloudJob", "CloudSettings", "cloud_document", "cloud_files", "work_on_cloud"]
