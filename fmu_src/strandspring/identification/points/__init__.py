"""The records as points that a spring is fitted to, and what is wrong with them before any fit."""
