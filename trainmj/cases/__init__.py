"""Many cases of a scenario: computed once, kept, gone on with; on this machine or a cluster."""
