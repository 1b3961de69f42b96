"""Pictures of a posed rig, drawn by pyrender: off the screen, in a window, into a video or into PNG files.

Importing this package imports no drawing library; the modules do that when a picture is first asked for.
"""
