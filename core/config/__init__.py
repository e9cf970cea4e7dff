"""The configuration file: its schema, its loading, its messages.

In: TOML text and flags. Out: a validated Config, frozen, with its hash.
Elsewhere: what a setting does (the stage that reads it), flags (cli).
"""

from collaudit.core.config.load import LoadedConfig, config_sha256, load_config, parse_config
from collaudit.core.config.schema import Config

__all__ = ["Config", "LoadedConfig", "config_sha256", "load_config", "parse_config"]
