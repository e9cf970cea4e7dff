"""The command line of collaudit: arguments in, exit codes out."""
