"""What is known from theory and the equation before levels are compared: orders, corners of the force, exact values."""
