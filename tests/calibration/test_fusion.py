import numpy as np

from quarc_ref.calibration.fusion import fuse_keypoints, keep_one_to_one


def make_keypoint(x, y, size=2.0, angle=0.0):
    scaled_cosine, scaled_sine = size * np.cos(angle), size * np.sin(angle)
    return [x, y, scaled_cosine, -scaled_sine, scaled_sine, scaled_cosine]


def test_a_static_feature_is_one_feature_at_its_mean_position():
    moments = [
        np.float32([make_keypoint(10, 10)]),
        np.float32([make_keypoint(10.4, 10), make_keypoint(50, 5)]),
    ]

    fused, indices_by_moment = fuse_keypoints(moments)

    assert [indices.tolist() for indices in indices_by_moment] == [[0], [0, 1]]
    np.testing.assert_allclose(fused[:, :2], [[10.2, 10], [50, 5]], atol=1e-4)


def test_features_of_another_size_or_orientation_stay_separate():
    original, larger, rotated = (
        make_keypoint(10, 10),
        make_keypoint(10, 10, size=3.0),
        make_keypoint(10, 10, angle=1.0),
    )

    _, indices_by_moment = fuse_keypoints(
        [np.float32([original]), np.float32([larger, rotated, original])]
    )

    assert indices_by_moment[1].tolist() == [1, 2, 0]


def test_two_features_of_the_same_moment_stay_separate():
    neighbors = [make_keypoint(10, 10), make_keypoint(10.2, 10)]

    _, indices_by_moment = fuse_keypoints(
        [np.float32([make_keypoint(10.1, 10)]), np.float32(neighbors)]
    )

    assert sorted(indices_by_moment[1].tolist()) == [0, 1]


def test_a_moment_without_features_is_valid():
    fused, indices_by_moment = fuse_keypoints(
        [np.zeros((0, 6), np.float32), np.float32([make_keypoint(1, 2)])]
    )

    assert len(fused) == 1
    assert [indices.tolist() for indices in indices_by_moment] == [[], [0]]


def test_of_contradicting_matches_the_most_frequent_stays():
    pairs = np.array([[0, 0], [0, 1], [0, 1], [2, 1], [2, 2]])

    assert keep_one_to_one(pairs).tolist() == [[0, 1], [2, 2]]
