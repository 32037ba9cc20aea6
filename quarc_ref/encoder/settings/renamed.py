"""Maps the old names of settings to the current names.

`--set` rejects an old name with a message that states the current name. `--resume`
translates old names in the metadata of a stream.
"""

RENAMED = {
    "canonical.every": "canonical.keyframe_interval",
    "canonical.snapshot_every": "canonical.snapshot_interval",
    "canonical.sh_from": "canonical.sh_from_iter",
    "canonical.dssim": "canonical.lambda_dssim",
    "canonical.noise": "canonical.position_noise",
    "canonical.densify_from": "canonical.densify_from_iter",
    "canonical.densify_until": "canonical.densify_until_iter",
    "canonical.densify_every": "canonical.densification_interval",
    "canonical.densify_gradient": "canonical.densify_grad_threshold",
    "canonical.densify_scale": "canonical.densify_scale_threshold",
    "canonical.keep_opacity": "canonical.final_prune_opacity",
    "canonical.halved_until": "canonical.half_resolution_until_iter",
    "canonical.exposure_rate": "canonical.exposure_lr",
    "canonical.exposure_from": "canonical.exposure_from_iter",
    "canonical.opacity_price": "canonical.opacity_reg",
    "canonical.scale_price": "canonical.scale_reg",
    "canonical.gaussian_price": "canonical.prune_rd_lambda",
    "canonical.code_price": "canonical.code_rd_lambda",
    "canonical.rate_end": "canonical.lr_end_factor",
    "canonical.position_rate": "canonical.position_lr",
    "canonical.position_rate_end": "canonical.position_lr_final",
    "canonical.sh_dc_rate": "canonical.sh_dc_lr",
    "canonical.sh_rest_rate": "canonical.sh_rest_lr",
    "canonical.opacity_rate": "canonical.opacity_lr",
    "canonical.scale_rate": "canonical.scale_lr",
    "canonical.rotation_rate": "canonical.rotation_lr",
    "motion.rate": "motion.lr",
    "motion.step_rate": "motion.translation_lr",
    "motion.level_rate": "motion.level_lr_factor",
    "motion.rate_end": "motion.lr_end_factor",
    "motion.dssim": "motion.lambda_dssim",
    "motion.price": "motion.rate_model",
    "motion.price_weight": "motion.rd_lambda",
    "births.gradient": "births.grad_threshold",
    "births.error": "births.error_threshold",
    "births.error_reach": "births.error_radius",
    "births.deaths_below": "births.death_opacity",
    "births.parent_scale": "births.max_parent_scale",
    "births.rate_factor": "births.lr_factor",
    "births.rate_end": "births.lr_end_factor",
    "births.split_at": "births.split_iters",
    "births.must_pay": "births.rd_selection",
    "births.byte_price": "births.rd_lambda",
    "updates.rate": "updates.lr",
    "updates.price_weight": "updates.rd_lambda",
    "updates.chosen_at": "updates.choose_at",
    "updates.select_at": "updates.choose_at",
    "updates.dies_below": "updates.death_opacity",
    "rate_weight": "rd_lambda",
}


def update_names(settings: str) -> str:
    """Replace old names in settings from the metadata of a stream (`NAME=VALUE ...`)."""
    items = (item.partition("=") for item in settings.split(" "))
    return " ".join(RENAMED.get(name, name) + equals + value for name, equals, value in items)
