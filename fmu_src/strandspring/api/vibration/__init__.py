"""Isolation and simulation of one mass and of systems."""
