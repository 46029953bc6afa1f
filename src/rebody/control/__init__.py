"""Policies: soft actor-critic, and the tracker that turns subgoals into joint actions."""
