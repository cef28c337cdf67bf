"""From sensor readings or joint torques to the wrench h of the laws, and the tool's load."""
