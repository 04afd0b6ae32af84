#!/usr/bin/env python3
"""Ends with 0 where tests get disks of their own: does what tests/support/own_disk.h does, and nothing of it stays."""
import ctypes
import os
import sys
import tempfile

NEW_NAMESPACE, NEW_USER, PRIVATE = 0x00020000, 0x10000000, 0x4000 | 0x40000  # CLONE_NEWNS, _NEWUSER, MS_REC | MS_PRIVATE
libc = ctypes.CDLL(None)


def may_mount(folder):
    if libc.unshare(NEW_NAMESPACE) != 0 and libc.unshare(NEW_USER | NEW_NAMESPACE) != 0:
        return False
    return (libc.mount(b"none", b"/", None, PRIVATE, None) == 0
            and libc.mount(b"tmpfs", os.fsencode(folder), b"tmpfs", 0, b"size=1000000") == 0)


with tempfile.TemporaryDirectory() as place:
    child = os.fork()
    if child == 0:
        os._exit(0 if may_mount(place) else 1)
    sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
