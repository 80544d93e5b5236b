"""What editors ask about programs, answered by pure functions from text and offset to data.

Places are spans of UTF-8 bytes, as everywhere; `lines` turns them into an editor's positions. Every
question has an answer while a program is being typed: what cannot be read is simply not there.
"""
