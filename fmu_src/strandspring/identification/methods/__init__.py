"""Methods of identification; each fits one spring to the steady parts of its records."""
