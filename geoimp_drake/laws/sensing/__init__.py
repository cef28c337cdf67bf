"""From a reaction force to the wrench of the laws."""
