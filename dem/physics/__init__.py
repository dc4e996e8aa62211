"""Laws and numbers that follow from them: contact, hinges, motors, strings, stable steps. No engine in it."""
