import numpy as np

from quarc_ref.calibration.fusion import fuse_keypoints, keep_one_to_one


def keypoint(x, y, size=2.0, angle=0.0):
    c, s = size * np.cos(angle), size * np.sin(angle)
    return [x, y, c, -s, s, c]


def test_a_static_feature_is_one_feature_at_its_mean_position():
    moments = [np.float32([keypoint(10, 10)]), np.float32([keypoint(10.4, 10), keypoint(50, 5)])]

    fused, places = fuse_keypoints(moments)

    assert [place.tolist() for place in places] == [[0], [0, 1]]
    np.testing.assert_allclose(fused[:, :2], [[10.2, 10], [50, 5]], atol=1e-4)


def test_features_of_another_size_or_orientation_stay_separate():
    same, larger, turned = keypoint(10, 10), keypoint(10, 10, size=3.0), keypoint(10, 10, angle=1.0)

    _, places = fuse_keypoints([np.float32([same]), np.float32([larger, turned, same])])

    assert places[1].tolist() == [1, 2, 0]


def test_two_features_of_the_same_moment_stay_separate():
    near = [keypoint(10, 10), keypoint(10.2, 10)]

    _, places = fuse_keypoints([np.float32([keypoint(10.1, 10)]), np.float32(near)])

    assert sorted(places[1].tolist()) == [0, 1]


def test_a_moment_without_features_is_valid():
    fused, places = fuse_keypoints([np.zeros((0, 6), np.float32), np.float32([keypoint(1, 2)])])

    assert len(fused) == 1
    assert [place.tolist() for place in places] == [[], [0]]


def test_of_contradicting_matches_the_most_frequent_stays():
    pairs = np.array([[0, 0], [0, 1], [0, 1], [2, 1], [2, 2]])

    assert keep_one_to_one(pairs).tolist() == [[0, 1], [2, 2]]
