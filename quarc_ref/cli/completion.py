"""Shell completion of option values."""


def complete_preset() -> list[str]:
    """Return the names of all presets."""
    from quarc_ref.encoder.settings.presets import PRESETS

    return list(PRESETS)


def complete_setting() -> list[tuple[str, str]]:
    """Return the text `KEY=` and the description of every setting."""
    from quarc_ref.encoder.settings.presets import choose_preset
    from quarc_ref.encoder.settings.setting_list import describe_settings

    return [
        (f"{setting.name}=", setting.description)
        for setting in describe_settings(choose_preset("main"))
    ]
