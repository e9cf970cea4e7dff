"""What all readers of files share: places in a file, bounded decompression, batches of raw messages.

In: bytes. Out: checked bytes and Batches.
Elsewhere: any one format.
"""
