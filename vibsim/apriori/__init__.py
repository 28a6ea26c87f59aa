"""What theory and the equation say before any level is compared: orders, corners of the force, exact values."""
