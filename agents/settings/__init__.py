"""What is trained, where and how: settings from YAML, typed and checked."""
