"""What a reader gets: JSON, HTML and tables, computed from an audit result."""
