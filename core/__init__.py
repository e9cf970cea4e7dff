"""The method: from logs to an audit result. Knows neither reports nor command line."""
