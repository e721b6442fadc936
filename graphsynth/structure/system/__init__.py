"""The structural integer system: the question, its variables and equations, every integer solution."""
