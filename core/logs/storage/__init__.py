"""What the readers of all formats share: their two interfaces, places in a file, bounded decompression.

In: bytes. Out: checked bytes, and the types readers return (batches of raw messages, columns of tables).
Elsewhere: any one format.
"""
