"""Hidden tasks of robots that a frozen module listens to."""

from rebody.bodies.robot import Reach
from rebody.tasks import BaseTask, TaskDistribution
from rebody.training.minds import within_reach


def test_a_robot_gets_the_modules_own_tasks_as_far_as_it_reaches():
    """Goals however far; a base task that it cannot do at all is left out."""
    learned = TaskDistribution(
        (BaseTask("goal", 2, 15), BaseTask("velocity", -3, -1), BaseTask("velocity", 1, 3), BaseTask("stand", 0.5, 1.5))
    )
    slow = Reach(speed=(-0.5, 2.3), distance=5.0, pitch=(-1.0, 1.0))
    assert within_reach(learned, slow).base_tasks == (
        BaseTask("goal", 2, 15),
        BaseTask("velocity", 1, 2.3),
        BaseTask("stand", 0.5, 1.0),
    )
