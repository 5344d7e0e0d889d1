"""The checks of scikit-learn that a dynamic model cannot pass."""

_SHAPE = "the check's X has several columns and few rows in no order; a system has one input, sampled in time, at least 100 times"
_WORDS = "the error is said in terms of signals and samples, not of features"
_FAILING = {
    _SHAPE: (
        "check_array_api_input check_dict_unchanged check_dont_overwrite_parameters check_dtype_object check_estimator_sparse_tag "
        "check_estimators_dtypes check_estimators_fit_returns_self check_estimators_overwrite_params check_estimators_pickle "
        "check_f_contiguous_array_estimator check_fit2d_predict1d check_fit_check_is_fitted check_fit_idempotent "
        "check_fit_score_takes_y check_methods_sample_order_invariance check_methods_subset_invariance check_n_features_in "
        "check_n_features_in_after_fitting check_pipeline_consistency check_positive_only_tag_during_fit "
        "check_readonly_memmap_input"
    ),
    _WORDS: (
        "check_complex_data check_estimator_sparse_array check_estimator_sparse_matrix check_estimators_empty_data_messages "
        "check_estimators_nan_inf check_fit2d_1feature check_fit2d_1sample"
    ),
}
EXPECTED_FAILED_CHECKS = {check: reason for reason, checks in _FAILING.items() for check in checks.split()}
"""The checks of scikit-learn's ``check_estimator`` that a dynamic model cannot pass, with the reasons.

:meta hide-value:
"""
